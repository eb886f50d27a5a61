/** The choice of the language, each by its own name. */
import { chooseLanguage, LANGUAGES, type Language, language, t } from './language.ts';
import './language.css';

export function LanguageSelect() {
  return (
    <select
      class="language"
      aria-label={t('Language')}
      title={t('Language')}
      value={language}
      onChange={(event) => chooseLanguage(event.currentTarget.value as Language)}
    >
      {Object.entries(LANGUAGES).map(([id, name]) => (
        <option key={id} value={id} lang={id}>
          {name}
        </option>
      ))}
    </select>
  );
}
